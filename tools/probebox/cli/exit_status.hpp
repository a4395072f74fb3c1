#pragma once

namespace probebox::command {

// What a script may rely on.
enum class ExitStatus : int {
  ok = 0,
  failed = 1,         // a refusal by a solver, a measurement that failed, an equation that does not balance
  usage = 2,          // wrong arguments, or input that cannot be read
  no_box = 3,         // no box found, or the link was lost for good
  box_refused = 4,    // the box answered no
  interrupted = 130,  // Ctrl-C: files are closed and whole
  reader_gone = 141,  // the reader of a pipe has exited, such as head: as if ended by SIGPIPE, without a word
};

}  // namespace probebox::command
