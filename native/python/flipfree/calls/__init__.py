"""The calls of the package, one module each; flipfree itself exports what is public."""
