"""Looking at a run while it goes on, and steering it: a page served to this machine's browser only.

The simulation stays in its supervised process, where `control` obeys between macro steps. The supervising process serves the
page (`server`), reads the rows as they are recorded (`feed`) and passes commands on through a pipe (`session`).
"""
