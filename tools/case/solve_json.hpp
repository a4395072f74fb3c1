#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

#include "firmware/metrology/dataset/result.hpp"
#include "tools/case/case_folder.hpp"

namespace probebox::casefolder {

// First key of every object below. Keys may be added within a version. Version 2 added those from `design` on, and the
// type B inputs to expanded_k2.
inline constexpr int kSchemaVersion = 2;

// The answer to one case as one JSON object, keys in this order: schema_version, method, case, status, result, sd,
// condition, rms, dof, warnings, then those that are known: chi2_reduced, chi2_dof, chi2_range (99.9 %), expanded_k2,
// covariance, dropped, convention, also, also_sd, design, design_figure, design_per, unobservable, weakest, budget,
// conditions, residuals. Numbers have the shortest digits that read back as the same double; null if not finite.
nlohmann::ordered_json toJson(const metrology::Result& result, std::string_view case_name);

// schema_version, method, case, status "refused", refusal (the stable name), reason ("name: sentence").
nlohmann::ordered_json toJson(const metrology::Refusal& refusal, std::string_view method, std::string_view case_name);

// schema_version, case, status "unreadable", reason: no method is known.
nlohmann::ordered_json toJson(const Unreadable& unreadable, std::string_view case_name);

}  // namespace probebox::casefolder
