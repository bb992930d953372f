"""Folders of extracted FMUs that no run uses."""

from cosim.components.fmi import file


def remove_idle_folders() -> None:
    """Remove the folders that are kept for further runs."""
    while file._idle_folders:
        file._idle_folders.popitem()[1].folder.cleanup()
