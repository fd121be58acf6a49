"""Thousands of models without a person watching: files in, files with certified maps out, one line of results each.

    inputs --plan--> items --run (or a farm)--> children, one model at a time --> outputs, lines of results

Knows neither Blender nor how a model is solved: an engine says which files it reads and writes and how its children are
started (``models/`` is the one for plain Python; the extension brings its own). docs/batch.md is the user's page.
"""
