"""Modbus analog modules behind a real pymodbus server, TCP or RTU, with the simulated rig on their terminals."""
