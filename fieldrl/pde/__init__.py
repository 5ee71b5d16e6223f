"""What the water does: initial features, sources, flows and the fields that they carry."""
