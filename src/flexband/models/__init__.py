"""Other people's models as responses: functions of one sample, programs, FMUs, UM-Bridge."""

from typing import TYPE_CHECKING

from flexband.basics.namespaces import lazy_names

if TYPE_CHECKING:
    from flexband.models.external_runs import elsewhere as elsewhere
    from flexband.models.fmu import FMU as FMU
    from flexband.models.one_by_one import samplewise as samplewise
    from flexband.models.program import ExternalProgram as ExternalProgram
    from flexband.models.umbridge_client import UMBridgeModel as UMBridgeModel
    from flexband.models.umbridge_server import UMBridgeServer as UMBridgeServer, serve as serve
else:
    __all__, __getattr__, __dir__ = lazy_names(__name__, __file__)
