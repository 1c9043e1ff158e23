"""How configurations are driven: what the arm must keep clear of, and checked ways from one to the next."""
