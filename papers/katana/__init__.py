"""The Katana 450 of Patel's thesis, which several studies share."""
