"""truearm makes serial robots accurate."""
