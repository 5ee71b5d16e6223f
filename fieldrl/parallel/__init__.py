"""Who does tasks: this process, worker processes (loky) or a Dask cluster. The only room that knows them."""
