#pragma once
#include "protocol/messages/corrections.hpp"
#include "protocol/messages/machine.hpp"
#include "protocol/messages/procedures.hpp"
#include "protocol/messages/results.hpp"
#include "protocol/messages/self_test.hpp"
#include "protocol/messages/status.hpp"
#include "protocol/messages/unit.hpp"
#include "protocol/messages/updates.hpp"

// Everything that can be asked of a box. Each operation has its number, a Request and an Answer.
