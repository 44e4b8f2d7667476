"""Robot descriptions: links, joints, and joint values; one file per format, one model for all of them."""
