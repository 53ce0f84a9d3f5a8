"""The pages of the project, built by Sphinx: python -m postprocess.docs [-o DIR].

The source of a page is a document of the project, as it stands: README.md of the project and of each package, the
gallery of cases, the tutorials. To these are added a page for each module from its docstrings, and pages of the
public names, of the keys of a case and of the command line, which are asked of the program.
"""
