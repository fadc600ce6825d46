"""Documentation site: pages of docs/, pages generated from the declarations of the program, and
their HTML.
"""
