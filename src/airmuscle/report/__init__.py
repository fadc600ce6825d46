"""Reports: chapters with claims, tables and figures; HTML, JSON and CSV output."""
