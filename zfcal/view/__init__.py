"""The page that shows a trial while it runs, and afterwards: what it shows, and its server."""
