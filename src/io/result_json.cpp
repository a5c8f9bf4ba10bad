// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/io/result_json.hpp"

#include <nlohmann/json.hpp>

namespace unirit {
namespace {

using Json = nlohmann::ordered_json;

Json toJson(const Eigen::Isometry3d& transform) {
  const Eigen::Vector3d& t = transform.translation();
  const Eigen::Quaterniond q(transform.linear());
  return {{"translation", {t.x(), t.y(), t.z()}}, {"rotation", {q.x(), q.y(), q.z(), q.w()}}};
}

Json toJson(const std::vector<PlausibilityCheck>& checks) {
  Json list = Json::array();
  for (const PlausibilityCheck& check : checks) {
    list.push_back({{"name", check.name},
                    {"value", check.value},
                    {"limit", check.limit},
                    {"passed", check.passed}});
  }
  return list;
}

}  // namespace

std::string toJson(const Registration& registration, const ResultOrigin& origin) {
  Json json;
  json["header"]["frame_id"] = origin.intraoperative_frame;
  json["id"] = 1;
  json["status"] = static_cast<int>(registration.status);
  json["message"] = registration.message;
  json["preoperative_frame"] = origin.preoperative_frame;
  json["start"] = origin.start;
  json["preprocessing_stages"] = Json::array();
  json["preprocessing_points"] = Json::array();
  for (const StagePoints& stage : origin.preprocessing) {
    json["preprocessing_stages"].push_back(stage.stage);
    json["preprocessing_points"].push_back(stage.points);
  }
  json["transform"] = toJson(registration.T_intraoperative_preoperative);
  json["residual_rms"] = registration.residual.rms;
  json["residual_median"] = registration.residual.median;
  json["residual_p95"] = registration.residual.p95;
  json["inlier_fraction"] = registration.residual.inlier_fraction;
  json["inlier_tolerance"] = origin.inlier_tolerance;
  json["coverage"] = registration.residual.coverage;
  json["displacement_rms"] = registration.displacement.rms;
  json["displacement_p95"] = registration.displacement.p95;
  json["displacement_max"] = registration.displacement.max;
  json["folded_fraction"] = registration.displacement.folded_fraction;
  json["checks"] = toJson(registration.checks);
  json["stages"] = Json::array();
  json["stage_milliseconds"] = Json::array();
  for (const StageTime& stage : registration.stages) {
    json["stages"].push_back(stage.stage);
    json["stage_milliseconds"].push_back(stage.milliseconds);
  }
  json["weights_sha256"] = origin.weights_sha256;
  json["settings_sha256"] = origin.settings_sha256;
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace unirit
