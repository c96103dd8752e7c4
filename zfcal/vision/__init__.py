"""From camera images to positions: cameras, frames, blobs, tracks, and images from positions."""
