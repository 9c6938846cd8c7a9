"""Gray-box identification: physical parameters from motor-side data."""
