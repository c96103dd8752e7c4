"""Reading what others may have put there: places, sizes, depths, and one content for one work."""
