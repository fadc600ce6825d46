"""Documentation site in build/docs/html: ./run docs, or python release/make_book.py with the extra
docs.
"""

from __future__ import annotations

import sys

from book.build import main

if __name__ == "__main__":
    sys.exit(main())
