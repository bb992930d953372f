"""Files that a run keeps on disk while it goes on."""
