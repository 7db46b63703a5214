"""The shading of cards for engines that read HLSL."""

import hair_hlsl


def test_the_files_are_what_the_code_makes() -> None:
    source = hair_hlsl.SOURCE.read_text(encoding="utf-8")
    for path, made in (
        (hair_hlsl.MODULE, hair_hlsl.module(source)),
        (hair_hlsl.TARGET, hair_hlsl.hlsl(source)),
        (hair_hlsl.NODES, hair_hlsl.nodes(source)),
    ):
        assert path.read_text(encoding="utf-8") == made, "run make docs"


def test_words_calls_and_vectors_of_one_number() -> None:
    made = hair_hlsl.hlsl(
        "const vec3 A = vec3(1.0);\nvec2 f() { return mix(vec2(a.x, 1), b, c(d, e)); }"
    )
    assert "static const float3 A = ((float3)(1.0));" in made
    assert "float2 f() { return lerp(float2(a.x, 1), b, c(d, e)); }" in made


def test_a_vector_of_one_call_with_commas() -> None:
    assert "((float3)(max(a, b)))" in hair_hlsl.hlsl("vec3 g() { return vec3(max(a, b)); }")
