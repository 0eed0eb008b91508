"""Start-up file that Python imports first in every process of an audit: installs the import hook for planted
faults."""

from validation.blind_spots import planting

planting.install_import_hook()
