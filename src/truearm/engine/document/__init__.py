"""What results are made of: records, summaries, tables, pictures and pages."""
