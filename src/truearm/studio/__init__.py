"""The studio: the jobs of the package in a browser, beside a project folder of plain files.

Nothing of this room is imported by the rest of the package, and it needs the extra ``truearm[studio]``.
"""
