"""Files as other programs write them: each case is a small file made by us, with its right answer; one parametrised test per kind.

The files lie in a folder beside the tests (`tests/cases/meshes`, ...). A case is backed by a public description of the format or a public bug report,
never copied from anybody. docs/files.md lists what is read from whom; each of its rows names the case behind it.
"""
