#pragma once

namespace probebox::command {

// Exit status of every command; scripts rely on these numbers.
enum class ExitStatus : int {
  ok = 0,
  failed = 1,         // refused by a solver, failed measurement, or samples that do not balance
  usage = 2,          // wrong arguments, or input that cannot be read
  no_box = 3,         // no box found, or the link was lost for good
  box_refused = 4,    // the box answered no
  interrupted = 130,  // Ctrl-C: files are closed and complete
  reader_gone = 141,  // the reader of the pipe has exited, such as head: as after SIGPIPE, without a message
};

}  // namespace probebox::command
