# Helpers that give every target of the package the same warnings, includes and install rules.

if(UNIRIT_SANITIZE)
  add_compile_options(-fsanitize=address,undefined -fno-sanitize-recover=undefined
                      -fno-omit-frame-pointer -g1 -O1)
  # Libraries call their own copies of templates, not those of a test, compiled without sanitizers.
  add_link_options(-fsanitize=address,undefined LINKER:-Bsymbolic-functions)
  # With the sanitizer, Eigen would ask for more memory than it needs and hand out a place inside:
  # what reads just before it would go unseen, and code compiled without could not free it.
  add_compile_definitions(EIGEN_MALLOC_ALREADY_ALIGNED=1)
endif()

function(unirit_configure target)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor)
  if(UNIRIT_WERROR)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
  target_include_directories(${target} PUBLIC
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include> $<INSTALL_INTERFACE:include>)
endfunction()

function(unirit_add_library target)
  add_library(${target} ${ARGN})
  unirit_configure(${target})
  set_target_properties(${target} PROPERTIES INSTALL_RPATH "$ORIGIN")
  install(TARGETS ${target}
    ARCHIVE DESTINATION ${UNIRIT_LIBRARY_DESTINATION}
    LIBRARY DESTINATION ${UNIRIT_LIBRARY_DESTINATION})
endfunction()

function(unirit_add_tool target)
  add_executable(${target} ${ARGN})
  unirit_configure(${target})
  set_target_properties(${target} PROPERTIES INSTALL_RPATH "$ORIGIN/..")
  install(TARGETS ${target} RUNTIME DESTINATION ${UNIRIT_BINARY_DESTINATION})
endfunction()
