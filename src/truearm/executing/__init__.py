"""Great work in parts: on processes of this machine, on a cluster, and recorded part by part."""
