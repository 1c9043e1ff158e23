"""Which joint effects the data support, and models for zones."""
