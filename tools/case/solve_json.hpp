#pragma once
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "firmware/metrology/result.hpp"

namespace probebox::casefolder {

// The answer to one case as one JSON object, keys in this order: method, case, status, result, sd, condition, rms, dof,
// warnings, then those that are known: chi2_reduced, expanded_k2, covariance, dropped, convention, also. Numbers have
// the digits that give the same double back. What is not finite becomes null.
nlohmann::ordered_json toJson(const metrology::Result& result, std::string_view case_name);

// method, case, status "refused", refusal (the stable name), reason ("name: sentence").
nlohmann::ordered_json toJson(const metrology::Refusal& refusal, std::string_view method, std::string_view case_name);

}  // namespace probebox::casefolder
