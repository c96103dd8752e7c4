"""Which name a heading's law lacks, by features in place of forms."""
