"""Section 7 of Ryan & Wolgemuth (2022): every figure and table, from runs of the shipped cases.

``python -m postprocess.paper`` runs what is missing and draws it all. One module a figure: `members(quick)` says
which runs it is made of, `draw(runs, quick)` draws them and gives the rows of the table of results.
"""
