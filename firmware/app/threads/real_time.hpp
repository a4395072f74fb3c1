#pragma once

// What a box asks of the kernel so that it never waits for memory or for lesser threads. What is not granted is said
// once, with what would grant it, and the daemon runs on.
namespace probebox::app {

// For the whole process, before it makes any thread: all its memory stays resident, what comes later included. Stacks
// and heaps are made small for that in any case.
void keepMemoryResident();

// For the calling thread: SCHED_FIFO.
void askForRealTime();

}  // namespace probebox::app
