"""Many paths of one scene: a runner over any executor, and the jobs that it runs."""
