"""Live view of a running simulation.

A page in the browser of this machine that shows and steers the run.

Two processes take part:

- The simulation process steps the components. `control.LiveControl` runs there, in the main thread,
  between macro steps.
- The supervising process serves the page. `live_view.LiveView` owns the HTTP server
  (`server.LiveServer`, one thread per request). `session.LiveSession` exchanges messages with the
  simulation process through a pipe, with a thread that receives them. `session.RowFeed` reads the
  recorded rows from the files of the run.
"""
