// Hair cards in the Universal Render Pipeline. Each of the three materials of an imported file is one
// pass of its sidecar; they differ in the states and the range of alpha below.
Shader "Hairloom/Cards"
{
    Properties
    {
        [Enum(UnityEngine.Rendering.CullMode)] _Cull ("Cull", Float) = 0
        [Toggle] _ZWrite ("Writes Depth", Float) = 1
        [Enum(UnityEngine.Rendering.BlendMode)] _SrcBlend ("Source Blend", Float) = 1
        [Enum(UnityEngine.Rendering.BlendMode)] _DstBlend ("Destination Blend", Float) = 0
        _MinAlpha ("Minimum Alpha", Range(0, 1)) = 0.99
        _MaxAlpha ("Maximum Alpha", Range(0, 2)) = 2

        [Enum(Kajiya Kay, 0, Marschner, 1)] _model ("Model", Float) = 0
        _base_color ("Base Color", Vector) = (0.3, 0.2, 0.1, 1)
        _tip_color ("Tip Color", Vector) = (0.3, 0.2, 0.1, 1)
        _tip_tint ("Tip Tint", Range(0, 1)) = 0
        _tint_start ("Tint Start", Range(0, 1)) = 0.3
        _tint_end ("Tint End", Range(0, 1)) = 0.9
        _grey_fraction ("Grey Fraction", Range(0, 1)) = 0
        _shift_noise ("Shift Noise", Float) = 0.2
        _sparkle ("Sparkle", Range(0, 1)) = 0.6
        _ambient ("Ambient", Float) = 1
        _primary_color ("Primary Color", Vector) = (1, 1, 1, 1)
        _primary_strength ("Primary Strength", Float) = 1
        _primary_exponent ("Primary Exponent", Float) = 200
        _primary_shift ("Primary Shift", Float) = 0.12
        _secondary_color ("Secondary Color", Vector) = (1, 1, 1, 1)
        _secondary_strength ("Secondary Strength", Float) = 1
        _secondary_exponent ("Secondary Exponent", Float) = 60
        _secondary_shift ("Secondary Shift", Float) = -0.2
        _fibre_root ("Fibre Root", Vector) = (0, 0, 0, 1)
        _fibre_tip ("Fibre Tip", Vector) = (0, 0, 0, 0)
        _fibre_strengths ("Fibre Strengths", Vector) = (1, 1, 1, 1)
        _fake_scattering ("Fake Scattering", Float) = 0.8
        _volume_shadow ("Volume Shadow", Float) = 1
        _base_gain ("Base Gain", Float) = 1
        _facing_range ("Mean and Minimum Facing", Vector) = (0, 0, 0, 0)
        [Toggle] _has_shift ("Has Shift Map", Float) = 0
        [Toggle] _has_tangent_map ("Has Tangent Map", Float) = 0
        [Enum(None, 0, Three Channels, 1, Two Channels, 2)] _has_normal_map ("Normal Map", Float) = 0
        [NoScaleOffset] _base_texture ("Base", 2D) = "white" {}
        [NoScaleOffset] _alpha_texture ("Alpha", 2D) = "white" {}
        [NoScaleOffset] _shift_texture ("Shift", 2D) = "grey" {}
        [NoScaleOffset] _noise_texture ("Noise", 2D) = "white" {}
        [NoScaleOffset] _tangent_texture ("Tangent", 2D) = "bump" {}
        [NoScaleOffset] _normal_texture ("Normal", 2D) = "bump" {}
        _alpha_mask ("Channel of Alpha", Vector) = (1, 0, 0, 0)
        _shift_mask ("Channel of Shift", Vector) = (1, 0, 0, 0)
        _noise_mask ("Channel of Noise", Vector) = (1, 0, 0, 0)
        _tangent_x ("Tangent across, of Red, Green, Blue and 1", Vector) = (1, 0, 0, 0)
        _tangent_y ("Tangent along", Vector) = (0, 1, 0, 0)
        _tangent_z ("Tangent out", Vector) = (0, 0, 1, 0)
        [NoScaleOffset] _longitudinal ("Longitudinal", 2D) = "black" {}
        [NoScaleOffset] _azimuthal ("Azimuthal", 2D) = "black" {}
        [NoScaleOffset] _paths ("Paths", 2D) = "black" {}
    }
    SubShader
    {
        // a project without this pipeline compiles none of it
        PackageRequirements { "com.unity.render-pipelines.universal": "14.0" }
        Tags { "RenderPipeline" = "UniversalPipeline" "IgnoreProjector" = "True" }
        Cull [_Cull]

        Pass
        {
            Name "Hair"
            Tags { "LightMode" = "UniversalForwardOnly" }
            ZWrite [_ZWrite]
            Blend [_SrcBlend] [_DstBlend], One OneMinusSrcAlpha

            HLSLPROGRAM
            #pragma target 3.5
            #pragma multi_compile _ _MAIN_LIGHT_SHADOWS _MAIN_LIGHT_SHADOWS_CASCADE
            #pragma multi_compile _ _ADDITIONAL_LIGHTS
            // the second is its name since Unity 6.1
            #pragma multi_compile _ _FORWARD_PLUS _CLUSTER_LIGHT_LOOP
            #pragma multi_compile_fragment _ _ADDITIONAL_LIGHT_SHADOWS
            #pragma multi_compile_fragment _ _SHADOWS_SOFT
            #pragma multi_compile_fragment _ LOD_FADE_CROSSFADE
            #pragma multi_compile_fog
            #pragma multi_compile_instancing
            #pragma vertex vertex
            #pragma fragment fragment
            #include "HairloomCards.hlsl"
            ENDHLSL
        }

        Pass
        {
            Name "DepthOnly"
            Tags { "LightMode" = "DepthOnly" }
            ZWrite On
            ColorMask R

            HLSLPROGRAM
            #pragma target 3.5
            #pragma multi_compile_fragment _ LOD_FADE_CROSSFADE
            #pragma multi_compile_instancing
            #pragma vertex vertex
            #pragma fragment fragment_of_depth
            #include "HairloomCards.hlsl"
            ENDHLSL
        }

        Pass
        {
            Name "DepthNormalsOnly"
            Tags { "LightMode" = "DepthNormalsOnly" }
            ZWrite On

            HLSLPROGRAM
            #pragma target 3.5
            #pragma multi_compile_fragment _ LOD_FADE_CROSSFADE
            #pragma multi_compile_instancing
            #pragma vertex vertex
            #pragma fragment fragment_of_normal
            #include "HairloomCards.hlsl"
            ENDHLSL
        }

        Pass
        {
            Name "ShadowCaster"
            Tags { "LightMode" = "ShadowCaster" }
            ZWrite On
            ColorMask 0

            HLSLPROGRAM
            #pragma target 3.5
            #pragma multi_compile_fragment _ LOD_FADE_CROSSFADE
            #pragma multi_compile_instancing
            #pragma vertex vertex_of_shadow
            #pragma fragment fragment_of_shadow
            #include "HairloomCards.hlsl"
            ENDHLSL
        }
    }
}
