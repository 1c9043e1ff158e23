"""What several features share. Nothing here knows a feature."""
