"""``python -m validation.report FOLDER``: write the report's page again from its saved results."""

import sys
from pathlib import Path

from models.core.errors import InputError
from validation.report.page import write

if len(sys.argv) != 2:
    sys.exit("usage: python -m validation.report FOLDER")
try:
    print(write(Path(sys.argv[1])))
except InputError as error:
    print(f"twinrig: {error}", file=sys.stderr)
    sys.exit(2)
