"""Reports: chapters of claims, tables and figures, and the files they become."""
