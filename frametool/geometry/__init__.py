"""Math on numbers: rotations, poses, Euler angles, cameras, covariances, positions on the Earth; no names, no files."""
