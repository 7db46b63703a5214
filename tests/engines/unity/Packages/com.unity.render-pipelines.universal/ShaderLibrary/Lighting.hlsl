// What HairloomCards.hlsl calls of Unity's own file of this name, for a compiler without Unity.
struct Light
{
    float3 direction;
    float3 color;
    float distanceAttenuation;
    float shadowAttenuation;
};

struct InputData
{
    float3 positionWS;
    float2 normalizedScreenSpaceUV;
};

float4 lights[16];
uint light_count;

float4 TransformWorldToShadowCoord(float3 place) { return float4(place, 1.0); }
float3 SampleSH(float3 normal) { return normal; }

Light light_of(uint number)
{
    Light light;
    light.direction = lights[2 * number].xyz;
    light.color = lights[2 * number + 1].xyz;
    light.distanceAttenuation = lights[2 * number].w;
    light.shadowAttenuation = lights[2 * number + 1].w;
    return light;
}

Light GetMainLight(float4 shadow) { return light_of(0); }
Light GetAdditionalLight(uint number, float3 place, half4 shadow) { return light_of(number + 1); }
uint GetAdditionalLightsCount() { return light_count; }
#define LIGHT_LOOP_BEGIN(count) for (uint lightIndex = 0u; lightIndex < count; ++lightIndex) {
#define LIGHT_LOOP_END }
