"""Cross fields and maps that follow them."""
