"""Analog modules on Modbus, TCP or RTU: any module that a register map describes."""
