"""Commands of `cosim`, one file each."""
