"""Other people's models as responses: functions of one sample, programs, FMUs, UM-Bridge."""
