"""The lake where the missions happen, as pictures: rendered off screen without a graphics card or display."""
