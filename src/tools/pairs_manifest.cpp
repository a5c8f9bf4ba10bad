// SPDX-License-Identifier: BSD-3-Clause
#include "pairs_manifest.hpp"

#include <filesystem>
#include <nlohmann/json.hpp>

namespace unirit {
namespace {

using Json = nlohmann::ordered_json;

Json protocolsJson(const std::vector<Protocol>& protocols) {
  Json json;
  for (const Protocol protocol : protocols) {
    const View view = viewOf(protocol);
    constexpr const char* kTargets[] = {"paired", "permuted", "resampled", "depth image"};
    Json& entry = json[toString(protocol)];
    entry = {{"target", kTargets[static_cast<int>(view.target)]},
             {"rotation_degrees", view.rotation},
             {"translation_of_half_extent", view.translation},
             {"offset_mm", 1000.0 * view.offset},
             {"noise_mm", 1000.0 * view.noise},
             {"outlier_share", view.outlier_share}};
    if (view.target != View::Target::kDepthImage) entry["visible_share"] = view.visible_share;
  }
  return json;
}

Json limitsJson(const ScreeningLimits& limits) {
  Json lengths;
  for (const auto& [organ, range] : limits.lengths) {
    lengths[organ] = {1000.0 * range.least, 1000.0 * range.most};
  }
  return {
      {"min_faces", limits.min_faces},
      {"max_open_share", limits.max_open_share},
      {"min_main_piece", limits.min_main_piece},
      {"lengths_mm", lengths},
      {"other_length_mm", {1000.0 * limits.other_length.least, 1000.0 * limits.other_length.most}}};
}

Json sourcesJson(const std::vector<SourceRecord>& sources) {
  Json json = Json::array();
  for (const SourceRecord& source : sources) {
    json.push_back({{"organ", source.organ},
                    {"subject", source.subject},
                    {"name", source.name},
                    {"sha256", source.sha256},
                    {"cases", source.cases},
                    {"rejected", source.rejected}});
  }
  return json;
}

}  // namespace

std::string pairsManifest(const PairsOptions& options, const BuiltPairs& pairs,
                          const std::vector<std::string>& left_out, const std::string& set_sha256) {
  const PairSettings& settings = options.settings;
  const Json json{{"format", "unirit-pairs"},
                  {"version", 1},
                  {"unirit", UNIRIT_VERSION},
                  {"file", std::filesystem::path(options.output).filename().string()},
                  {"sha256", set_sha256},
                  {"cases", pairs.set.cases.size()},
                  {"seed", settings.seed},
                  {"points", settings.points},
                  {"surface_samples", settings.surface_samples},
                  {"deformations", settings.deformations},
                  {"variations", settings.variations},
                  {"subjects", settings.subjects},
                  {"phantoms", options.phantoms},
                  {"unit_mm", 1000.0 * options.unit},
                  {"exclude", options.exclude},
                  {"protocols", protocolsJson(settings.protocols)},
                  {"screening", limitsJson(settings.limits)},
                  {"sources", sourcesJson(pairs.sources)},
                  {"left_out", left_out}};
  return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace unirit
