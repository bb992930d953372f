"""Parts of floating vessels: hull, wave loads, equations."""
