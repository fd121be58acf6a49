"""What is known of a map by its values alone, and what follows from it."""
