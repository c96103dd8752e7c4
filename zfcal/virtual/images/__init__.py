"""Images that a camera over or below a tank would see of animals at known places."""
