#pragma once

// Requests real-time behaviour from the kernel. What is not permitted is logged once with the setting that permits it;
// the daemon continues.
namespace probebox::app {

// Locks all present and future memory of the process. Call before threads are made. Limits the size of stacks and heaps
// in any case, so that little memory is locked.
void keepMemoryResident();

// Requests SCHED_FIFO for the calling thread.
void askForRealTime();

}  // namespace probebox::app
