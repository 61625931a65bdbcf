"""What there is: scenes, meshes, motions, policies, beliefs."""
