"""Words that every room shares: samples, domain, parameters, checks, random streams."""
