"""Robots of the library and their files: `truearm robots`, `show`, `ik`, `convert`, `export`."""
