// The passes of HairloomCards.shader. Unity's axes are left-handed, and HairShading.hlsl has crosses of
// a right-handed space: all vectors it gets are mirrored by `mirrored`.
#ifndef HAIRLOOM_CARDS
#define HAIRLOOM_CARDS

#include "Packages/com.unity.render-pipelines.universal/ShaderLibrary/Core.hlsl"
#include "Packages/com.unity.render-pipelines.universal/ShaderLibrary/Lighting.hlsl"
#include "HairShading.hlsl"

CBUFFER_START(UnityPerMaterial)
float _Cull, _ZWrite, _SrcBlend, _DstBlend, _MinAlpha, _MaxAlpha;
float _model, _tip_tint, _tint_start, _tint_end, _grey_fraction, _shift_noise, _sparkle, _ambient;
float _primary_strength, _primary_exponent, _primary_shift;
float _secondary_strength, _secondary_exponent, _secondary_shift;
float _fake_scattering, _volume_shadow, _base_gain, _has_shift, _has_tangent_map, _has_normal_map;
float4 _base_color, _tip_color, _primary_color, _secondary_color;
float4 _fibre_root, _fibre_tip, _fibre_strengths, _facing_range;
float4 _alpha_mask, _shift_mask, _noise_mask, _tangent_x, _tangent_y, _tangent_z;
CBUFFER_END

Texture2D _base_texture, _alpha_texture, _shift_texture, _noise_texture, _tangent_texture, _normal_texture;
Texture2D _longitudinal, _azimuthal, _paths;
SamplerState sampler_base_texture, sampler_alpha_texture, sampler_shift_texture, sampler_noise_texture;
SamplerState sampler_tangent_texture, sampler_normal_texture;

struct Corner
{
    float4 position : POSITION;
    float3 normal : NORMAL;
    float4 tangent : TANGENT;
    float2 uv : TEXCOORD0;
    float2 occlusion_and_along : TEXCOORD1;
    UNITY_VERTEX_INPUT_INSTANCE_ID
};

struct CardPoint
{
    float4 position : SV_POSITION;
    float2 uv : TEXCOORD0;
    float2 occlusion_and_along : TEXCOORD1;
    float3 place : TEXCOORD2;
    float3 normal : TEXCOORD3;
    float3 tangent : TEXCOORD4;
    float fog : TEXCOORD5;
    UNITY_VERTEX_OUTPUT_STEREO
};

float3 mirrored(float3 direction)
{
    return direction * float3(-1.0, 1.0, 1.0);
}

CardPoint vertex(Corner corner)
{
    CardPoint result;
    UNITY_SETUP_INSTANCE_ID(corner);
    UNITY_INITIALIZE_VERTEX_OUTPUT_STEREO(result);
    result.place = TransformObjectToWorld(corner.position.xyz);
    result.position = TransformWorldToHClip(result.place);
    result.fog = ComputeFogFactor(result.position.z);
    result.uv = corner.uv;
    result.occlusion_and_along = corner.occlusion_and_along;
    result.normal = TransformObjectToWorldNormal(corner.normal);
    result.tangent = TransformObjectToWorldDir(corner.tangent.xyz);
    return result;
}

HairMaterial material_of_hair()
{
    HairMaterial hair;
    hair.model = (int)_model;
    hair.base_color = _base_color.xyz;
    hair.tip_color = _tip_color.xyz;
    hair.tip_tint = _tip_tint;
    hair.tint_start = _tint_start;
    hair.tint_end = _tint_end;
    hair.grey_fraction = _grey_fraction;
    hair.shift_noise = _shift_noise;
    hair.sparkle = _sparkle;
    hair.ambient = _ambient;
    hair.primary_color = _primary_color.xyz;
    hair.primary_strength = _primary_strength;
    hair.primary_exponent = _primary_exponent;
    hair.primary_shift = _primary_shift;
    hair.secondary_color = _secondary_color.xyz;
    hair.secondary_strength = _secondary_strength;
    hair.secondary_exponent = _secondary_exponent;
    hair.secondary_shift = _secondary_shift;
    hair.fibre_root = _fibre_root;
    hair.fibre_tip = _fibre_tip;
    hair.fibre_strengths = _fibre_strengths;
    hair.fake_scattering = _fake_scattering;
    hair.volume_shadow = _volume_shadow;
    return hair;
}

HairPlace place_of_hair(CardPoint card, float3 to_eye)
{
    HairPlace here;
    float3 normal = hair_unit(mirrored(card.normal), float3(0.0, 0.0, 1.0));
    float3 tangent = hair_unit(mirrored(card.tangent), float3(0.0, 0.0, 1.0));
    here.normal = normal;
    here.tangent = tangent;
    here.to_eye = to_eye;
    here.along = card.occlusion_and_along.y;
    here.base = _base_gain * _base_texture.Sample(sampler_base_texture, card.uv).xyz;
    here.shift = 0.5;
    here.sparkle = dot(_noise_texture.Sample(sampler_noise_texture, card.uv), _noise_mask);
    if (_has_tangent_map > 0.5)
    {
        float3 texel = _tangent_texture.Sample(sampler_tangent_texture, card.uv).xyz;
        texel = hair_texel(texel, _tangent_x, _tangent_y, _tangent_z);
        here.tangent = hair_tangent(texel, tangent, normal, _shift_noise);
    }
    else if (_has_shift > 0.5)
    {
        here.shift = dot(_shift_texture.Sample(sampler_shift_texture, card.uv), _shift_mask);
    }
    if (_has_normal_map > 0.5)
    {
        float3 texel = _normal_texture.Sample(sampler_normal_texture, card.uv).xyz;
        if (_has_normal_map > 1.5)  // of two channels
        {
            float2 aside = 2.0 * texel.xy - 1.0;
            texel.z = 0.5 + 0.5 * sqrt(saturate(1.0 - dot(aside, aside)));
        }
        here.normal = hair_normal(texel, tangent, normal);
    }
    return here;
}

float3 radiance_of(HairMaterial hair, HairPlace here, Light light)
{
    float3 sent = hair_light(hair, _longitudinal, _azimuthal, _paths, here, mirrored(light.direction));
    // Unity's lights have pi in them: a white wall that faces a light of 1 is white
    return HAIR_PI * light.color * (light.distanceAttenuation * light.shadowAttenuation) * sent;
}

// Unity's number is 1 to 0 for a level that goes and -1 to 0 for the one that comes.
void leave_pixels_to_other_level(float4 position)
{
#if defined(LOD_FADE_CROSSFADE)
    float fade = unity_LODFade.x;
    float2 part = fade < 0.0 ? float2(-fade, 1.0) : float2(0.0, fade);
    clip(hair_level_has(position.xy, part) ? 1.0 : -1.0);
#endif
}

float3 to_eye_of(CardPoint card)
{
    return mirrored(GetWorldSpaceNormalizeViewDir(card.place));
}

// Coverage of a pixel of this pass; the others are left out. The depths of a pass are those of the same pixels.
float coverage_of(CardPoint card)
{
    UNITY_SETUP_STEREO_EYE_INDEX_POST_VERTEX(card);
    leave_pixels_to_other_level(card.position);
    float alpha = dot(_alpha_texture.Sample(sampler_alpha_texture, card.uv), _alpha_mask);
    if (_facing_range.x > 0.0)
    {
        float3 across = cross(ddx(card.place), ddy(card.place));
        float3 tangent = hair_unit(mirrored(card.tangent), float3(0.0, 0.0, 1.0));
        alpha = hair_view_compensated_alpha(alpha, mirrored(across), tangent, to_eye_of(card), _facing_range.xy);
    }
    clip(alpha - _MinAlpha);
    clip(_MaxAlpha - alpha - 1.0e-6);
    return alpha;
}

float4 fragment(CardPoint card) : SV_Target
{
    float alpha = coverage_of(card);
    HairMaterial hair = material_of_hair();
    HairPlace here = place_of_hair(card, to_eye_of(card));
    float3 radiance = radiance_of(hair, here, GetMainLight(TransformWorldToShadowCoord(card.place)));
#if defined(_ADDITIONAL_LIGHTS)
    InputData inputData = (InputData)0;
    inputData.positionWS = card.place;
    inputData.normalizedScreenSpaceUV = GetNormalizedScreenSpaceUV(card.position);
#if USE_FORWARD_PLUS || USE_CLUSTER_LIGHT_LOOP  // the loop after it has lamps alone then
    for (uint sun = 0; sun < min(URP_FP_DIRECTIONAL_LIGHTS_COUNT, MAX_VISIBLE_LIGHTS); sun++)
    {
        radiance += radiance_of(hair, here, GetAdditionalLight(sun, card.place, half4(1, 1, 1, 1)));
    }
#endif
    uint count = GetAdditionalLightsCount();
    LIGHT_LOOP_BEGIN(count)
        radiance += radiance_of(hair, here, GetAdditionalLight(lightIndex, card.place, half4(1, 1, 1, 1)));
    LIGHT_LOOP_END
#endif
    float occlusion = card.occlusion_and_along.x;
    radiance *= hair_lit_fraction(hair, occlusion);
    radiance += hair_ambient(hair, here.along, here.base, occlusion) * SampleSH(card.normal);
    radiance = MixFog(radiance, card.fog);
    return float4(radiance, _MaxAlpha > 1.0 ? 1.0 : alpha);
}

float4 fragment_of_depth(CardPoint card) : SV_Target
{
    coverage_of(card);
    return card.position.z;
}

float4 fragment_of_normal(CardPoint card) : SV_Target
{
    coverage_of(card);
    return float4(hair_unit(card.normal, float3(0.0, 0.0, 1.0)), 0.0);
}

float3 _LightDirection;  // Unity sets it for each light

CardPoint vertex_of_shadow(Corner corner)
{
    CardPoint result = vertex(corner);
    result.position = TransformWorldToHClip(ApplyShadowBias(result.place, result.normal, _LightDirection));
#if UNITY_REVERSED_Z
    result.position.z = min(result.position.z, result.position.w * UNITY_NEAR_CLIP_VALUE);
#else
    result.position.z = max(result.position.z, result.position.w * UNITY_NEAR_CLIP_VALUE);
#endif
    return result;
}

// A shadow map knows no half: what covers more than half of a pixel throws a shadow.
float4 fragment_of_shadow(CardPoint card) : SV_Target
{
    UNITY_SETUP_STEREO_EYE_INDEX_POST_VERTEX(card);
    leave_pixels_to_other_level(card.position);
    clip(dot(_alpha_texture.Sample(sampler_alpha_texture, card.uv), _alpha_mask) - 0.5);
    return 0.0;
}

#endif
