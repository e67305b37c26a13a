# embed_text(target name glob): generated/name.h with `inline constexpr EmbeddedText name[]`, a row a file, sorted.
function(embed_text target name glob)
  file(GLOB files CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/${glob})
  list(SORT files)
  set(output ${CMAKE_BINARY_DIR}/generated/${name}.h)
  set(script ${CMAKE_SOURCE_DIR}/cmake/embed.cmake)
  add_custom_command(OUTPUT ${output} DEPENDS ${files} ${script}
    COMMAND ${CMAKE_COMMAND} -DOUTPUT=${output} -DNAME=${name} "-DFILES=${files}" -P ${script} VERBATIM)
  target_sources(${target} PRIVATE ${output})
endfunction()

# compile_shaders(target glob): each name.stage.glsl becomes generated/name.stage.spv.h with `name_stage_spv[]`.
function(compile_shaders target glob)
  file(GLOB files CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/${glob})
  file(GLOB_RECURSE shared CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/*.shared.h ${CMAKE_SOURCE_DIR}/*.glsl.h)
  find_program(GLSLANG glslangValidator REQUIRED)
  foreach(file ${files})
    get_filename_component(base ${file} NAME_WLE)    # name.stage
    string(REPLACE "." ";" parts ${base})
    list(GET parts 1 stage)
    string(REPLACE "." "_" symbol ${base})
    set(output ${CMAKE_BINARY_DIR}/generated/${base}.spv.h)
    add_custom_command(OUTPUT ${output} DEPENDS ${file} ${shared}
      COMMAND ${CMAKE_COMMAND} -E make_directory ${CMAKE_BINARY_DIR}/generated
      COMMAND ${GLSLANG} --quiet -S ${stage} --target-env vulkan1.3 -I${CMAKE_SOURCE_DIR}
        -I${CMAKE_BINARY_DIR}/generated --vn ${symbol}_spv -o ${output} ${file} VERBATIM)
    target_sources(${target} PRIVATE ${output})
  endforeach()
endfunction()

# commit_header(target): generated/commit.h with LOAM_COMMIT, rewritten only where the commit changed.
function(commit_header target)
  add_custom_target(loam_commit BYPRODUCTS ${CMAKE_BINARY_DIR}/generated/commit.h
    COMMAND ${CMAKE_COMMAND} -DSOURCE=${CMAKE_SOURCE_DIR} -DOUTPUT=${CMAKE_BINARY_DIR}/generated/commit.h
      -P ${CMAKE_SOURCE_DIR}/cmake/commit.cmake VERBATIM)
  add_dependencies(${target} loam_commit)
endfunction()

# concept_folder(target folder MACRO [not a member...]): generated/<folder with _>.list.h holds MACRO(name) for each
# folder/name.cpp, sorted.
# A member is one file; the folder is the registry, and nothing depends on globals that a linker may drop.
function(concept_folder target folder macro)
  file(GLOB files CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/${folder}/*.cpp)
  list(SORT files)
  set(text "")
  foreach(file ${files})
    get_filename_component(name ${file} NAME_WE)
    if(NOT name IN_LIST ARGN)
      string(APPEND text "${macro}(${name})\n")
    endif()
  endforeach()
  string(REPLACE "/" "_" list ${folder})
  file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/generated/${list}.list.h CONTENT "${text}")
  target_include_directories(${target} PRIVATE ${CMAKE_BINARY_DIR}/generated)
endfunction()

# shared_concept_folder(target folder MACRO [not a member...]): as concept_folder, for members that are written once for
# C++ and GLSL, folder/name.shared.h. Beside the list, generated/<folder with _>.members.h includes all members, numbers
# them, #define MACRO_name 0 ..., and calls one by its number: DISPATCH_MACRO(member, function, (arguments)) returns
# name_function(arguments) of the member, and goes on where there is none of that number. Both compilers read both files.
function(shared_concept_folder target folder macro)
  file(GLOB files CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/${folder}/*.shared.h)
  list(SORT files)
  set(list_text "")
  set(members_text "")
  set(cases "")
  set(number 0)
  foreach(file ${files})
    get_filename_component(name ${file} NAME_WE)
    if(NOT name IN_LIST ARGN)
      string(APPEND list_text "${macro}(${name})\n")
      string(APPEND members_text "#include \"${folder}/${name}.shared.h\"\n#define ${macro}_${name} ${number}\n")
      string(APPEND cases
        "    case ${macro}_${name}: if (CALLED_FOR_${macro}(${macro}_${name})) return ${name}_##function arguments; break; \\\n")
      math(EXPR number "${number} + 1")
    endif()
  endforeach()
  string(APPEND members_text
    "#ifndef CALLED_FOR_${macro}\n#define CALLED_FOR_${macro}(number) true\n#endif\n"
    "#define DISPATCH_${macro}(member, function, arguments) \\\n  switch (member) { \\\n${cases}  }\n")
  string(REPLACE "/" "_" list ${folder})
  file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/generated/${list}.list.h CONTENT "${list_text}")
  file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/generated/${list}.members.h CONTENT "${members_text}")
  target_include_directories(${target} PRIVATE ${CMAKE_BINARY_DIR}/generated)
endfunction()
