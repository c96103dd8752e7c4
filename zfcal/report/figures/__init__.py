"""One figure a file, and what they share: panels and colours."""
