"""Hard cases: scenes at the edge of what is allowed, each with an answer known from elsewhere."""
