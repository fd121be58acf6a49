"""The engine of plain Python: OBJ, PLY, OFF and STL files through the package's own reader and writer."""
