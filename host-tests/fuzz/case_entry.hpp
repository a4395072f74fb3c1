#pragma once
#include <cstddef>
#include <cstdint>

// What both the fuzzer and the ordinary test feed: a case of the tests, as the first byte chooses it, changed as the
// other bytes say, six for a change: cells, columns, rows, tables, units and keys that are wrong, missing, exchanged or
// there twice. It is solved, written and read again, and shown as a page. Aborts when the answer is neither a refusal
// with a known name and a sentence nor a result of finite values.
int feedCase(const std::uint8_t* data, std::size_t size);
