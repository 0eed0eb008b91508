"""``python -m validation.price.sheets FOLDER``: write all problem sheets and their input files into a new folder."""

import sys
from pathlib import Path

from models.core.result_folders import new_folder
from validation.price.sheets import main

main(new_folder(Path(sys.argv[1]) if sys.argv[1:] else None, "sheets"))
