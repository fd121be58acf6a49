"""Files that get a new map and keep all else: what a file has besides texture coordinates is copied, never understood.

    content, polygons of the file + a map of its triangles --polygons--> texture coordinates of corners --obj, ply--> content

Each format finds the faces as the reader in C++ does, and leaves the rest as it stands.
"""
