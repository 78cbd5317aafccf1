"""Where runs are made and kept: worker processes, clusters, stores."""

from typing import TYPE_CHECKING

from flexband.basics.namespaces import lazy_names

if TYPE_CHECKING:
    from flexband.execution.dask import Dask as Dask
    from flexband.execution.processes import Processes as Processes
    from flexband.execution.store import Store as Store, open_runs as open_runs
else:
    __all__, __getattr__, __dir__ = lazy_names(__name__, __file__)
