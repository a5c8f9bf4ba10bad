// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/io/organ_names.hpp"

#include <algorithm>
#include <cctype>
#include <iterator>
#include <set>
#include <string_view>
#include <vector>

namespace unirit {
namespace {

struct Synonym {
  std::string_view words;  // joined
  std::string_view organ;
};

/// The ten classes of the benchmark and the organs that public collections name beside them.
constexpr Synonym kSynonyms[] = {
    {"liver", "liver"},
    {"hepar", "liver"},
    {"kidney", "kidney"},
    {"kidneys", "kidney"},
    {"kidneytumor", "kidney_tumor"},
    {"kidneytumour", "kidney_tumor"},
    {"kidneywithtumor", "kidney_tumor"},
    {"kidneywithtumour", "kidney_tumor"},
    {"brain", "brain"},
    {"cerebrum", "brain"},
    {"braintumor", "brain_tumor"},
    {"braintumour", "brain_tumor"},
    {"brainminustumor", "brain_tumor"},
    {"brainminustumour", "brain_tumor"},
    {"gallbladder", "gallbladder"},
    {"vesicabiliaris", "gallbladder"},
    {"vesicafellea", "gallbladder"},
    {"stomach", "stomach"},
    {"gaster", "stomach"},
    {"pancreas", "pancreas"},
    {"spleen", "spleen"},
    {"lien", "spleen"},
    {"atrium", "atrium"},
    {"leftatrium", "atrium"},
    {"atriumleft", "atrium"},
    {"heartatrium", "atrium"},
    {"heartatriumleft", "atrium"},
    {"leftheartatrium", "atrium"},
    {"heartleftatrium", "atrium"},
    {"smallbowel", "small_bowel"},
    {"smallintestine", "small_bowel"},
    {"smallgut", "small_bowel"},
    {"intestinumtenue", "small_bowel"},
    {"ileum", "small_bowel"},
    {"jejunum", "small_bowel"},
    {"rightatrium", "right_atrium"},
    {"atriumright", "right_atrium"},
    {"heartatriumright", "right_atrium"},
    {"rightheartatrium", "right_atrium"},
    {"heartrightatrium", "right_atrium"},
    {"heart", "heart"},
    {"myocardium", "heart"},
    {"heartmyocardium", "heart"},
    {"heartventricle", "ventricle"},
    {"duodenum", "duodenum"},
    {"colon", "colon"},
    {"largebowel", "colon"},
    {"largeintestine", "colon"},
    {"lung", "lung"},
    {"bladder", "urinary_bladder"},
    {"urinarybladder", "urinary_bladder"},
    {"prostate", "prostate"},
    {"uterus", "uterus"},
    {"adrenalgland", "adrenal_gland"},
    {"aorta", "aorta"},
    {"esophagus", "esophagus"},
};

/// Beside an organ's name they leave open whether the file shows the organ.
constexpr std::string_view kParts[] = {
    "tumor",  "tumour",  "tumors", "tumours", "lesion",     "lesions", "cyst",  "cysts",
    "vessel", "vessels", "vein",   "veins",   "artery",     "duct",    "ducts", "segment",
    "lobe",   "stone",   "stones", "cancer",  "metastasis", "wall"};

enum class Kind { kOther, kLower, kUpper, kDigit };

Kind kindOf(char c) {
  const auto byte = static_cast<unsigned char>(c);
  if (std::isdigit(byte)) return Kind::kDigit;
  if (std::isupper(byte)) return Kind::kUpper;
  return std::isalpha(byte) ? Kind::kLower : Kind::kOther;
}

/// "s0123_GallBladder" -> s, gall, bladder: a word ends where letters do, or where a capital
/// follows a small letter.
std::vector<std::string> wordsOf(const std::string& name) {
  std::vector<std::string> words;
  Kind before = Kind::kOther;
  for (const char c : name) {
    const Kind kind = kindOf(c);
    if (kind == Kind::kLower || kind == Kind::kUpper) {
      const bool begins = before == Kind::kOther || before == Kind::kDigit ||
                          (before == Kind::kLower && kind == Kind::kUpper);
      if (begins) words.emplace_back();
      words.back() += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
    before = kind;
  }
  return words;
}

std::string join(const std::vector<std::string>& words, std::size_t first, std::size_t last) {
  std::string joined;
  for (std::size_t i = first; i < last; ++i) joined += words[i];
  return joined;
}

std::string_view organCalled(const std::string& joined_words) {
  const auto* found =
      std::find_if(std::begin(kSynonyms), std::end(kSynonyms),
                   [&](const Synonym& synonym) { return synonym.words == joined_words; });
  return found == std::end(kSynonyms) ? std::string_view() : found->organ;
}

}  // namespace

OrganGuess organInFileName(const std::string& stem) {
  constexpr std::size_t kMostWords = 4;
  const std::vector<std::string> words = wordsOf(stem);
  std::set<std::string> organs;
  std::string part;
  for (std::size_t first = 0; first < words.size();) {
    std::size_t next = first + 1;
    std::size_t last = std::min(words.size(), first + kMostWords);
    // The longest synonym that begins here: "kidney tumor" is no kidney
    while (last > first && organCalled(join(words, first, last)).empty()) --last;
    if (last > first) {
      organs.emplace(organCalled(join(words, first, last)));
      next = last;
    } else if (std::count(std::begin(kParts), std::end(kParts), words[first]) > 0) {
      part = words[first];
    }
    first = next;
  }
  if (organs.empty()) return {{}, "names no organ of the table"};
  if (organs.size() > 1) {
    return {
        {}, "is ambiguous: it names both " + *organs.begin() + " and " + *organs.rbegin(), true};
  }
  if (!part.empty()) {
    return {{},
            "is ambiguous: it names " + *organs.begin() + " and " + part +
                ", which may be the organ or a part of it",
            true};
  }
  return {*organs.begin(), {}};
}

bool isOrgan(const std::string& name) {
  return std::any_of(std::begin(kSynonyms), std::end(kSynonyms),
                     [&](const Synonym& synonym) { return synonym.organ == name; });
}

std::string organOfFolder(const std::string& name) {
  const std::vector<std::string> words = wordsOf(name);
  const std::string_view organ = organCalled(join(words, 0, words.size()));
  return organ.empty() ? name : std::string(organ);
}

std::pair<std::string, std::string> splitOrganAndSubject(const std::string& name) {
  std::size_t end = 0;
  for (const Synonym& synonym : kSynonyms) {
    const std::string organ(synonym.organ);
    if (organ.size() > end && name.compare(0, organ.size() + 1, organ + "_") == 0) {
      end = organ.size();
    }
  }
  if (end == 0) end = name.find('_');
  if (end == std::string::npos) return {name, {}};
  return {name.substr(0, end), name.substr(end + 1)};
}

}  // namespace unirit
