"""From images to tracks: the empty tank, blobs, animals, identities and the robot."""
