"""The criteria of ISO 9283:1998, evaluated from measurements, each with an interval."""
